use super::*;
use crate::geometry::Bounds;

/// The corner tetrahedron of a cube of side 1 and the one that joins its three other corners.
fn space() -> Mesh<3> {
    let points = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 1.0, 1.0]];
    Mesh::new(points, vec![0, 1, 2, 3, 1, 2, 3, 4]).unwrap()
}

fn square() -> Mesh<2> {
    let points = vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    Mesh::new(points, vec![0, 1, 2, 2, 3, 0]).unwrap()
}

fn group<const D: usize>(id: u32, name: &str, facets: &[[u32; D]]) -> FacetGroup<D> {
    FacetGroup { id, name: name.into(), facets: facets.to_vec() }
}

#[test]
fn sides_of_a_square_run_around_it_counter_clockwise() {
    let mesh = square();
    let tags = Tags::sides(&mesh, &Bounds::of(mesh.points()).unwrap(), 0.0);
    let expected = [
        group(1, "xmin", &[[3, 0]]),
        group(2, "xmax", &[[1, 2]]),
        group(3, "ymin", &[[0, 1]]),
        group(4, "ymax", &[[2, 3]]),
    ];
    assert_eq!(tags.facet_groups(), expected);
    assert_eq!(tags.clone().turned().facet_group("xmin").unwrap().facets, [[0, 3]]);
    assert_eq!(Tags::new(&mesh, expected.to_vec(), None), Ok(tags));
}

#[test]
fn only_facets_on_the_box_are_its_sides_and_their_normals_point_out() {
    let mesh = space();
    let tags = Tags::sides(&mesh, &Bounds::of(mesh.points()).unwrap(), 0.0);
    let sides: Vec<_> = tags.facet_groups().iter().map(|g| g.facets.len()).collect();
    assert_eq!(sides, [1, 0, 1, 0, 1, 0]);
    for group in tags.facet_groups() {
        for &[a, b, c] in &group.facets {
            assert!(mesh.simplex(&[a, b, c, 4]).orientation() < 0.0, "{}", group.name);
        }
    }
}

#[test]
fn a_facet_between_two_cells_is_no_side() {
    // within so large a tolerance the diagonal lies on every side
    let mesh = square();
    let tags = Tags::sides(&mesh, &Bounds::of(mesh.points()).unwrap(), 2.0);
    assert_eq!(tags.facet_groups()[0].facets.len(), 4);
    let tags = Tags::new(&mesh, tags.facet_groups().to_vec(), None);
    assert!(tags.is_ok(), "{tags:?}");
}

#[test]
fn what_does_not_fit_is_named() {
    let mesh = square();
    let wrong = |groups: &[FacetGroup<2>], regions: Option<Regions>| {
        Tags::new(&mesh, groups.to_vec(), regions).unwrap_err().to_string()
    };
    let message = wrong(&[group(1, "a", &[[1, 3]])], None);
    assert_eq!(message, "facet group \"a\" has the corners [1, 3]; expected a facet of the mesh");
    assert!(wrong(&[group(1, "a", &[[1, 9]])], None).contains("[1, 9]"));
    assert!(wrong(&[group(1, "a", &[[1, 1]])], None).contains("[1, 1]"));
    assert!(wrong(&[group(1, "a", &[[1, 2], [2, 1]])], None).contains("[1, 2] twice"));
    assert!(wrong(&[group(0, "a", &[])], None).contains("has the id 0"));
    assert!(wrong(&[group(1, "a", &[]), group(1, "b", &[])], None).contains("\"b\" has the id 1"));
    for name in ["", "two words", "1a", "a\"b", "é", &"a".repeat(65)] {
        assert!(wrong(&[group(1, name, &[])], None).contains(&format!("the name {name:?}")));
    }
    let named = |names: &[(i32, &str)]| {
        let names = names.iter().map(|(id, name)| (*id, (*name).to_string())).collect();
        Some(Regions { of_cells: vec![1, 2], names })
    };
    assert!(wrong(&[group(1, "a", &[])], named(&[(1, "a")])).contains("the name \"a\""));
    assert!(wrong(&[], named(&[(1, "a"), (1, "b")])).contains("region 1 has two names"));
    let short = Regions { of_cells: vec![1], names: vec![] };
    assert_eq!(wrong(&[], Some(short)), "regions of 1 cells for a mesh of 2");
}

#[test]
fn merging_joins_groups_of_one_name_and_numbers_others_on() {
    let mesh = square();
    let tags = |groups: &[FacetGroup<2>]| Tags::new(&mesh, groups.to_vec(), None).unwrap();
    let first = tags(&[group(1, "a", &[[0, 2], [0, 1]]), group(4, "b", &[])]);
    let second = tags(&[group(7, "a", &[[2, 0], [1, 2]]), group(1, "c", &[[0, 1]])]);
    let merged = first.merge(second).unwrap();
    let expected =
        [group(1, "a", &[[0, 2], [0, 1], [1, 2]]), group(4, "b", &[]), group(5, "c", &[[0, 1]])];
    assert_eq!(merged.facet_groups(), expected);
    let regions = Some(Regions { of_cells: vec![3, -1], names: vec![(3, "rock".into())] });
    let with_regions = Tags::new(&mesh, vec![], regions).unwrap();
    let merged = merged.merge(with_regions.clone()).unwrap();
    let found = merged.regions().unwrap();
    assert_eq!(found.ids(), [-1, 3]);
    assert_eq!([found.name(3), found.name(-1)], ["rock", "region--1"]);
    assert_eq!(merged.merge(with_regions), Err(TagsError::TwoRegions));
}

#[test]
fn points_are_in_one_group_and_names_are_of_one_tag() {
    let mesh = square();
    let wells = |id, name: &str, points: &[u32]| PointGroup {
        id,
        name: name.into(),
        points: points.to_vec(),
    };
    let with = |groups| Tags::default().with_point_groups(&mesh, groups);
    let tags = with(vec![wells(1, "well-1", &[2]), wells(3, "tips", &[0, 3])]).unwrap();
    assert_eq!(tags.group_of_points(4), [3, 0, 1, 3]);
    assert!(!tags.is_empty());
    let sides = Tags::sides(&mesh, &Bounds::of(mesh.points()).unwrap(), 0.0);
    assert_eq!(sides.clone().merge(tags.clone()).unwrap().point_groups(), tags.point_groups());
    let point = |name: &str, point| Err(TagsError::Point { name: name.into(), point });
    assert_eq!(with(vec![wells(1, "a", &[4])]), point("a", 4));
    assert_eq!(with(vec![wells(1, "a", &[1]), wells(2, "b", &[1])]), point("b", 1));
    assert_eq!(
        with(vec![wells(1, "a", &[1]), wells(1, "b", &[2])]),
        Err(TagsError::Id { name: "b".into(), id: 1 })
    );
    let taken = sides.with_point_groups(&mesh, vec![wells(1, "xmin", &[1])]);
    assert_eq!(taken, Err(TagsError::Name { name: "xmin".into() }));
}
